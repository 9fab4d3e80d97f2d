"""The bench lies in tools/, which is no package of the product."""
