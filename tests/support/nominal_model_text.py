"""A nominal model of one axis: 50 kg, 100 N s/m, 12 N, a screw of 5 mm, encoder and scale."""

WITHOUT_SCALE = """
[axis.x.transmission]
lead_mm = 5.0
[axis.x.motor]
torque_constant_nm_a = 0.4
[axis.x.table]
mass_kg = 50.0
[axis.x.encoder]
counts_per_rev = 1000000
[axis.x.viscous_friction]
viscous_n_s_m = 100.0
[axis.x.coulomb_friction]
coulomb_n = 12.0
"""
WITH_SCALE = f"""{WITHOUT_SCALE}
[axis.x.scale]
resolution_um = 0.1
"""
