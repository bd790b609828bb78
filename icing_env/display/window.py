"""A window that shows the flight display, for `render_mode="human"`. Needs pygame, which the core does without."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any

import numpy as np

from icing_env.errors import InputError


def _pygame() -> ModuleType:
    try:
        return importlib.import_module("pygame")
    except ImportError as error:
        raise InputError(
            "render_mode 'human' needs pygame: install the extra with `pip install icing[render]`, or use 'rgb_array'"
        ) from error


class Window:
    """A window on the screen, opened at the first frame.

    With the environment variable SDL_VIDEODRIVER=dummy it works without a screen.

    Args:
        title: text of the title bar.
        fps: most frames a second; `show` waits as long as that takes. 0: never wait.

    Raises:
        InputError: pygame is not installed.
    """

    def __init__(self, title: str = "Icing testbed", fps: float = 0.0) -> None:
        self._pygame = _pygame()
        self._title = title
        self._fps = fps
        self._surface: Any = None
        self._clock: Any = None

    def show(self, frame: np.ndarray) -> bool:
        """Put a frame on the screen.

        Args:
            frame: uint8 array, shape (height, width, 3), RGB.

        Returns:
            False once the user has closed the window, and True until then.
        """
        pygame = self._pygame
        size = (frame.shape[1], frame.shape[0])
        if self._surface is None or self._surface.get_size() != size:
            pygame.display.init()
            self._surface = pygame.display.set_mode(size)
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
        self._surface.blit(pygame.image.frombuffer(np.ascontiguousarray(frame).tobytes(), size, "RGB"), (0, 0))
        pygame.display.flip()
        if self._fps > 0.0:
            self._clock.tick(self._fps)
        return not any(event.type == pygame.QUIT for event in pygame.event.get())

    def close(self) -> None:
        """Close the window; a second call does nothing."""
        if self._surface is not None:
            self._pygame.display.quit()
            self._surface = None
