"""The compiled engine. Importing it brings the compiler, so only what uses it does."""
