"""One question a file or folder, each a command."""
