"""Report of solved contacts; figures of measured surfaces, friction curves and vibration."""
