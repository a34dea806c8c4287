"""The pictures of the book, drawn from small runs of the templates and of the pages' scenarios."""
