"""What structures and problems show of themselves, as text and as tables of notebooks."""

from symhbm.model.shown.structures import as_text, rows_of
from symhbm.model.shown.tables import as_table

__all__ = ["as_table", "as_text", "rows_of"]
