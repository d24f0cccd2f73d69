"""Nodes that the middleware takes for those of another process: each in a context of its own."""

import rclpy
from rclpy.node import Node


class OtherProcesses:
    """They only publish: nothing spins them."""

    def __init__(self, domain: int):
        self.domain = domain
        self.nodes: list[Node] = []

    def add(self, name: str) -> Node:
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=self.domain)
        self.nodes.append(Node(name, context=context))
        return self.nodes[-1]

    def close(self) -> None:
        for node in self.nodes:
            node.destroy_node()
            rclpy.shutdown(context=node.context)
