"""Case of a smooth ball bearing on a small grid."""

BALLS = """
lubricant = { grade = "VG 68", temperature = "70 degC" }
surface = "flat"
machine.kind = "ball-bearing"
machine.balls = 9
machine.ball_diameter = "9.525 mm"
machine.pitch_diameter = "46 mm"
machine.radial_load = "2 kN"
machine.speed = "3000 r/min"
grid.cells = [64, 48]
"""
