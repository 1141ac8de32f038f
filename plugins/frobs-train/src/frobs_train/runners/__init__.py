"""Run many jobs (seeds, trials and evaluations) on one or more machines."""
