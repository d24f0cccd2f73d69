"""The methods of estimation, one file each; `core.methods` has their table."""
