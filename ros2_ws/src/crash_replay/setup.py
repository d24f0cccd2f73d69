from setuptools import find_packages, setup

setup(
    name="crash_replay",
    version="0.1.0",
    packages=find_packages(),
    package_data={"crash_replay": ["fastdds_*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/crash_replay"]),
        ("share/crash_replay", ["package.xml"]),
    ],
    entry_points={
        "console_scripts": [
            "import = crash_replay.import_command:main",
            "synthesize = crash_replay.synthesize_command:main",
            "record = crash_replay.record_command:main",
            "replay = crash_replay.replay_command:main",
        ]
    },
)
