"""The page of solved contacts and its exhibits; figures of measured surfaces, friction curves and vibration."""
