"""Package `ahv`: built by colcon as ament_python, and by pip into a virtual environment."""

from glob import glob

from setuptools import setup

NAME = "ahv"
NODES = {
    "plant": "ahv_plant.plant_node",
    "outer_intermediate": "ahv_control.outer_intermediate_node",
    "inner_loop": "ahv_control.inner_loop_node",
    "velocity": "ahv_control.velocity_node",
    "recorder": "ahv_analysis.recorder_node",
}

setup(
    name=NAME,
    version="0.1.0",
    description="Flight software for an air-breathing hypersonic vehicle as a ROS 2 node graph",
    license="Apache-2.0",
    python_requires=">=3.11,<3.13",
    packages=["ahv_plant", "ahv_control", "ahv_msgs_py", "ahv_analysis"],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config/cases", glob("config/cases/*.yaml")),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
    ],
    install_requires=[
        "setuptools",
        "numpy",  # arrays of flights
        "scipy",  # trim solver, rotations
        "numba>=0.60",  # the vehicle and the laws at machine speed
        "rosbags>=0.11",  # MCAP bags without a ROS installation
        "matplotlib",  # figures
        "typer",  # the `ahv` command
        "rich",  # its tables and progress bars
        "pyyaml",  # case files
    ],
    extras_require={
        # ROS itself where there is no ROS installation; a ROS machine brings its own
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": ["pytest", "hypothesis", "mcap", "mcap-ros2-support", "mpmath", "ruff"],
    },
    entry_points={
        "console_scripts": [
            "ahv = ahv_analysis.command:main",
            *(f"{name} = {module}:main" for name, module in NODES.items()),
        ]
    },
    zip_safe=True,
)
