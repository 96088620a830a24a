"""Count the designs of a whole results file by conditions and bins, exactly, from an index that is made once."""
