"""What a calibrated model may lack: candidates, the fingerprint each would leave, and score tests of the residual.

May import: effects, case, site, measurements, engine, calibration.
Open first: candidates.py, residual_screening.py.
"""
