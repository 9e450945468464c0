"""One file per figure and per question, listed in ``__main__``.

Each has ``NAME``, ``compute(progress=True) -> Dataset``, ``draw(dataset) -> Figure`` and
``landmarks(dataset) -> list[Landmark]``, and runs on its own: ``python -m studies.<name>``.
Where ``draw`` has other axes than the source, ``draw_on_source_axes(dataset) -> Figure`` has those.
Its docstring is what the page of all studies says: the first line the title, the rest the text.
"""
