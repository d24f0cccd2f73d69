"""Makes the ROS 2 wheels' CMake exports name this machine's include folders, not those of the machine that built them.

python rewrite_exports.py FOLDER_OF_PYTHON_H
"""

import re
import sys
from pathlib import Path

import numpy

BUILT_ON = r'/opt/python/[^;"]*?'
REPLACEMENTS = {
    BUILT_ON + r"/site-packages/numpy/_core/include": numpy.get_include(),
    BUILT_ON + r"/include/python3\.\d+": sys.argv[1],
}


def rewrite(text: str) -> str:
    for pattern, folder in REPLACEMENTS.items():
        text = re.sub(pattern, lambda _, folder=folder: folder, text)
    return text


for export in Path(sys.prefix, "share").glob("*/cmake/*Export.cmake"):
    before = export.read_text()
    after = rewrite(before)
    if after != before:
        export.write_text(after)
