"""A physics cell (MuJoCo): table, tool and object."""
