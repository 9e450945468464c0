"""Pictures inside of the page of all studies: sharp, and small ones for its contents."""

from base64 import b64encode
from io import BytesIO
from pathlib import Path

from PIL import Image

DENSITY = 2
"""Pixels of a picture for each one of the page."""
_SMALL = 440
"""Width of a picture of the contents [pixel]."""
_COLOURS = 256


def embedded(picture: Path) -> tuple[str, int, int]:
    """A picture as the address of an image, and its width and height in the page."""
    with Image.open(picture) as image:
        width, height = image.size
        return _address(image.convert("RGB")), width // DENSITY, height // DENSITY


def small(picture: Path) -> str:
    """The address of a small picture."""
    with Image.open(picture) as image:
        height = image.height * _SMALL // image.width
        return _address(image.convert("RGB").resize((_SMALL, height), Image.Resampling.LANCZOS))


def _address(image: Image.Image) -> str:
    """An image of few colours, which takes a third of the bytes."""
    few = image.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    file = BytesIO()
    few.save(file, format="PNG", optimize=True)
    return f"data:image/png;base64,{b64encode(file.getvalue()).decode()}"
