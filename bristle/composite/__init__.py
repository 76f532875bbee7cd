"""A whole scenario as one component: its parts solved together by the coupled engine's step."""
