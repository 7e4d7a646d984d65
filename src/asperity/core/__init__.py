"""What every room uses: errors, arrays, files, limits, processes, storage, quantities, signals."""
