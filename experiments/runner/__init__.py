"""Runs an experiment's tasks on all cores or a cluster, and stores what each returns."""
