"""The one authority over motion: grants, what needs one, and how axes are stopped."""
