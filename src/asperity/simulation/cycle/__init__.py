"""Contact over a cycle of load and speeds: film in time, load share at some instants, totals."""
