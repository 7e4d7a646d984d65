"""Full film, mixed or boundary lubrication, by the share of the load that asperities carry."""

FULL_FILM_BELOW = 0.01  # CLR
BOUNDARY_FROM = 0.9


def lubrication(clr: float, *, lubricated: bool) -> str:
    """Return full film, mixed or boundary lubrication by the load share, or dry contact."""
    if not lubricated:
        return "Dry contact"
    if clr < FULL_FILM_BELOW:
        return "Full film"
    return "Boundary lubrication" if clr >= BOUNDARY_FROM else "Mixed lubrication"
