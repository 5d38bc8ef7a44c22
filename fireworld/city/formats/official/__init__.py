"""Maps of the official program: a folder with map.gml, scenario.xml and *.cfg, read as the official reader does."""
