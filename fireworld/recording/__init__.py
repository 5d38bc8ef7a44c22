"""Recordings: runs recorded, replayed, verified, compared, forked, explained, exported; golden recordings; pages."""
