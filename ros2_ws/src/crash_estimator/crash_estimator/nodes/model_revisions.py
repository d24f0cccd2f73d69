"""The model that the diagnosis asks about, and its revisions: effects are added to it and taken out by services."""

from collections.abc import Callable, Mapping, Sequence

from crash_msgs.srv import AddEffect, RemoveEffect
from rclpy.node import Node

from crash_replay.recording import Test

from ..core.effects.change import remove_effect
from ..core.effects.effect import Effect
from ..core.structure import EffectSpec, ModelError, Structure
from .effect_requests import request_of, with_effect


class ModelRevisions:
    def __init__(
        self, node: Node, structure: Structure, effects: Mapping[str, Effect], estimators: Sequence[str],
        test: Callable[[], Test | None], changed: Callable[[], str],
    ):  # fmt: skip
        """estimators: to whose models `add` adds as well; test: the present one; changed: is called after each change,
        and gives the model's name."""
        self.node, self.structure, self.number = node, structure, 0
        self.effects, self.test, self.changed = effects, test, changed
        self.also_add = {name: node.create_client(AddEffect, f"{name}/add_effect") for name in estimators}
        self.adding: set[str] = set()  # estimators that have not answered yet
        node.create_service(AddEffect, "~/add_effect", self._on_add_effect)
        node.create_service(RemoveEffect, "~/remove_effect", self._on_remove_effect)

    def add(self, effect: EffectSpec) -> None:
        """What was found, here and to the estimators."""
        request = request_of(effect)
        self._add_to_estimators(request)
        self.node.get_logger().info(self._on_add_effect(request, AddEffect.Response()).message)

    def _add_to_estimators(self, request: AddEffect.Request) -> None:
        for name, client in self.also_add.items():
            if not client.service_is_ready():
                self.node.get_logger().warning(f"there is no service {client.srv_name}: is there an estimator {name}?")
                continue
            self.adding.add(name)
            client.call_async(request).add_done_callback(lambda call, name=name: self._say(name, call.result()))

    @property
    def complete(self) -> bool:
        """Whether what was found is in all estimators' models: who waits for the last word waits for that, too."""
        return not any(self.also_add[name].service_is_ready() for name in self.adding)

    def _say(self, name: str, response: AddEffect.Response) -> None:
        self.adding.discard(name)
        log = self.node.get_logger()
        (log.info if response.success else log.warning)(f"{name}: {response.message}")

    def _on_add_effect(self, request: AddEffect.Request, response: AddEffect.Response) -> AddEffect.Response:
        return self._change(lambda: with_effect(self.structure, request, self.effects, self.test()), response)

    def _on_remove_effect(
        self, request: RemoveEffect.Request, response: RemoveEffect.Response
    ) -> RemoveEffect.Response:
        return self._change(lambda: remove_effect(self.structure, request.effect, request.target), response)

    def _change(self, change: Callable[[], Structure], response):
        try:
            self.structure = change()
        except ModelError as error:
            response.message = str(error)
            return response
        self.number += 1
        response.success, response.message = True, f"revision {self.number}: {self.changed()}"
        return response
