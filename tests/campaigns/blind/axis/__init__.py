"""The concealed axis, compiled: controller, drive, friction, forces on the table, two bodies, sensors.

Each file is one of these, for one step of time; `simulate` calls them in turn.
"""
