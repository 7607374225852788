"""Published studies measured again, and the pages that show what came out."""
