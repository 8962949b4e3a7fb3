"""The nodes of a vision system: those of the standard's nodeset, without the optional ones that nothing answers."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asyncua import Server, ua

from debulk import InputError

NAMESPACE = "http://opcfoundation.org/UA/MachineVision"
Tree = Mapping[str, "Tree"]

# Optional nodes that this server has; below each one that is named, all mandatory ones stay.
_KEPT: Tree = {
    "RecipeManagement": {},
    "ResultManagement": {},
    "VisionStateMachine": {"AutomaticModeStateMachine": {}},
}


class Nodes:
    """A vision system and the types that its events have."""

    def __init__(self, server: Server, space: int, system: Any) -> None:
        self._server, self.space, self.system = server, space, system

    async def at(self, path: str) -> Any:
        """Return the node below the system at a path of browse names, such as "ResultManagement/GetResultById"."""
        return await self.system.get_child([self._named(name) for name in path.split("/")])

    async def parts(self, name: str) -> dict[str, Any]:
        """Return the identities of the nodes below a type, such as a state machine's states and transitions."""
        return {(await one.read_browse_name()).Name: one.nodeid for one in await (await self.type(name)).get_children()}

    async def type(self, name: str) -> Any:
        """Return a type of the standard by its browse name."""
        for root in (self._server.nodes.base_object_type, self._server.nodes.base_event_type):
            if found := await self._below(root, name):
                return found
        raise InputError(f"the nodeset has no {name}")

    async def _below(self, root: Any, name: str) -> Any:
        for child in await root.get_referenced_nodes(ua.ObjectIds.HasSubtype, ua.BrowseDirection.Forward):
            if (await child.read_browse_name()).Name == name:
                return child
            if found := await self._below(child, name):
                return found
        return None

    def _named(self, name: str) -> str:
        return name if ":" in name else f"{self.space}:{name}"


async def load_types(server: Server, nodeset: Path) -> int:
    """Load the standard's types from its nodeset, and return the index of its namespace."""
    try:
        await server.import_xml(nodeset)
        space = await server.get_namespace_index(NAMESPACE)
        await _complete(server, server.nodes.base_structure_type)
        await server.load_data_type_definitions()
        ua.ResultDataType  # noqa: B018, it has been made from the nodeset
    except Exception as error:  # whatever a file that is none may cause
        raise InputError(
            f"--nodeset {nodeset}: expected Opc.Ua.MachineVision.NodeSet2.xml of {NAMESPACE}: {error}"
        ) from None
    return int(space)


async def _complete(server: Server, above: Any, inherited: Any = None) -> None:
    """Give each structure that adds nothing to the one above its definition, without which no client can read it.

    The nodeset leaves this to its reader, and `asyncua` does not do it.
    """
    for node in await above.get_referenced_nodes(ua.ObjectIds.HasSubtype, ua.BrowseDirection.Forward):
        if not node.nodeid.NamespaceIndex:
            continue
        try:
            defined = await node.read_data_type_definition()
        except ua.UaError:
            defined = None
        if defined is None and inherited is not None:
            encodings = await node.get_referenced_nodes(ua.ObjectIds.HasEncoding, ua.BrowseDirection.Forward)
            named = {(await one.read_browse_name()).Name: one.nodeid for one in encodings}
            defined = copy.copy(inherited)
            defined.DefaultEncodingId = named["Default Binary"]
            defined.BaseDataType = above.nodeid
            await node.write_data_type_definition(defined)
            vars(ua).pop((await node.read_browse_name()).Name, None)  # the class of the one above, taken for want of it
        await _complete(server, node, defined)


async def made(server: Server, space: int, name: str) -> Nodes:
    """Make a vision system among the server's objects."""
    own = await server.register_namespace("urn:debulk")
    nodes = Nodes(server, space, server.nodes.objects)
    kind = await nodes.type("VisionSystemType")
    nodes.system = await server.nodes.objects.add_object(own, name, objecttype=kind.nodeid)
    await _pruned(server, kind, nodes.system, _KEPT)
    return nodes


async def _pruned(server: Server, kind: Any, made: Any, kept: Tree) -> None:
    """Take out what the type calls optional and nothing here answers."""
    for declared in await kind.get_children():
        name = await declared.read_browse_name()
        rules = await declared.get_referenced_nodes(ua.ObjectIds.HasModellingRule)
        if not rules:
            continue
        node = await made.get_child([name])
        rule = (await rules[0].read_browse_name()).Name
        if rule == "Optional" and name.Name not in kept:
            await server.delete_nodes([node], recursive=True)
        elif name.Name in kept:
            below = await server.get_node(node).read_type_definition()
            await _pruned(server, server.get_node(below), node, kept[name.Name])
