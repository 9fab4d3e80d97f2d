"""Choose an input shaper: test pattern, measured waves, accelerometer logs, prediction on a job."""
