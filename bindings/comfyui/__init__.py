"""Nodes for ComfyUI: meshes of other nodes become quads, and quads become files. The folder goes to ComfyUI/custom_nodes; requirements.txt names the package that it needs."""
from .nodes import NODE_CLASS_MAPPINGS, NODE_DISPLAY_NAME_MAPPINGS

__all__ = ["NODE_CLASS_MAPPINGS", "NODE_DISPLAY_NAME_MAPPINGS"]
