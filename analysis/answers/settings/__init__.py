"""The settings of a study: design points, ranking, averages over others, Sobol indices."""
