"""The blind benchmark: cases of the independent generator, asked, scored and counted."""
