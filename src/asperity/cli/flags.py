"""The library's messages name arguments; on the command line the same remedies name options."""

_OPTIONS = {
    "give rate_hz": "give --rate",
    "give scale": "give --scale",
    "give case or band_hz": "give --case or --band",
    "; method modes": "; --method modes",
    "such as um and mm": "such as --unit um --lateral-unit mm",
    "choose another out": "choose another --out",
}


def with_flags(message: str) -> str:
    """A message of the library with options in place of the arguments that it asks for."""
    for argument, option in _OPTIONS.items():
        message = message.replace(argument, option)
    return message
