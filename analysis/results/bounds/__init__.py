"""Upper bounds of the missions of a study, as files of its results folder."""
