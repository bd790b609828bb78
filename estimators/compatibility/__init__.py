"""Data compatibility: do the measured accelerations, rates, angles and airspeed belong to one motion?"""
