from glob import glob

from setuptools import find_packages, setup

setup(
    name="crash_estimator",
    version="0.1.0",
    packages=find_packages(),
    package_data={"crash_estimator": ["models/*.yaml", "thesis/*.yaml", "benchmarks/*.cpp", "templates/*.html"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/crash_estimator"]),
        ("share/crash_estimator", ["package.xml"]),
        ("share/crash_estimator/launch", glob("launch/*.launch.py")),
        ("share/crash_estimator/models", glob("crash_estimator/models/*.yaml")),
    ],
    entry_points={
        "console_scripts": [
            "composed = crash_estimator.nodes.composed_command:main",
            "demo = crash_estimator.demo.command:main",
            "diagnose = crash_estimator.cli.diagnose:main",
            "diagnosis = crash_estimator.nodes.diagnosis_command:main",
            "estimate = crash_estimator.cli.estimate:main",
            "estimator = crash_estimator.nodes.estimator_command:main",
            "report = crash_estimator.cli.report:main",
            "simulate = crash_estimator.cli.simulate:main",
            "viewer = crash_estimator.nodes.viewer_command:main",
        ]
    },
)
