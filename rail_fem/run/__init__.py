"""One run: job, launching, a look at the installation."""
