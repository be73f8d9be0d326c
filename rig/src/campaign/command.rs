//! `campaign`: runs cases, prints the table and writes it.
