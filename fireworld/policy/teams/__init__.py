"""Learned teams: one base class, one file format, one module for each kind.

* `team.py`: `Team`, `load_team`, and the registry of kinds.
* `NAME_team.py`: a kind of team; `NAME_words.py`: what such a team does, in words.
* `npz.py`: files of arrays with a header; how teams show themselves: `fireworld.shown`.
* `shipped.py`: the teams that come with fireworld.

Another kind is a module `NAME_team.py` with a subclass of `Team`; docs/training.md says what it needs.
"""
