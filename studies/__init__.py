"""The studies, a file each: ``plan`` (which trials), ``answer`` (tables to tables), ``draw``."""
