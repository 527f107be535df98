# Builds the book in target/book. Needs mdBook (`cargo install mdbook`).
book:
    mdbook build docs
