"""What a dataset tells of itself in words: one account for command line, page and notebook."""

from symhbm.results.telling.account import account, as_text
from symhbm.results.telling.comparison import compare, differences
from symhbm.results.telling.words import Words

__all__ = ["Words", "account", "as_text", "compare", "differences"]
