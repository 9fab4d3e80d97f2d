"""Pictures of the planner for the documentation."""
