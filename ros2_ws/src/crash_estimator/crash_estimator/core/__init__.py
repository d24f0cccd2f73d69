"""Models, estimation, validation and diagnosis: arrays in, arrays out; neither ROS nor files nor a viewer."""
