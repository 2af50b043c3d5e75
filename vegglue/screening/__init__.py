"""What a calibrated model may lack: candidates, the fingerprint each would leave, and score tests of the residual.

May import: effects, case, site, measurements, engine, results, calibration.
Open first: candidates.py, score_test.py.
"""
