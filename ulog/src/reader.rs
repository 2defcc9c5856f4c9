//! A file to rows, texts and parameters.
