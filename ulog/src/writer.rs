//! Rows, texts and parameters to a file.
