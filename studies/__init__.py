"""One file per figure and per question, listed in ``__main__``.

Each has ``NAME``, ``compute(progress=True) -> Dataset``, ``draw(dataset) -> Figure`` and
``landmarks(dataset) -> list[Landmark]``, and runs on its own: ``python -m studies.<name>``.
Its docstring is what the page of all studies says: the first line the title, the rest the text.
"""
