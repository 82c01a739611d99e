"""The compiled engine; only `constants` and `expected` can be imported without the compiler."""
