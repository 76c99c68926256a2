"""The server's types as messages: models, conversion, errors, and their OpenAPI document."""
