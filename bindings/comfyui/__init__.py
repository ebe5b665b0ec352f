"""Nodes for ComfyUI: meshes of other nodes become quads, and quads become files. The folder goes to ComfyUI/custom_nodes; the package quadwright (make python) has to be
installed in ComfyUI's Python. No torch is needed by these nodes themselves."""
from .nodes import NODE_CLASS_MAPPINGS, NODE_DISPLAY_NAME_MAPPINGS

__all__ = ["NODE_CLASS_MAPPINGS", "NODE_DISPLAY_NAME_MAPPINGS"]
