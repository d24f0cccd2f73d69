from setuptools import find_packages, setup

setup(
    name="crash_examples",
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/crash_examples"]),
        ("share/crash_examples", ["package.xml"]),
    ],
    entry_points={"console_scripts": ["air_bag_trigger = crash_examples.air_bag_trigger:main"]},
)
