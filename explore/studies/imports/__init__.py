"""Linkages of other programs as studies: files of pylinkage, expressions of Pyslvs, addresses of PMKS+."""
