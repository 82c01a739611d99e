"""Predicted time and memory of a run, and the measurements that the predictions rest on."""
