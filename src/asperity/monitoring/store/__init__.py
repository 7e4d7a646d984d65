"""Store of monitored machines: the SQLite file, its sensors and their notifications."""
