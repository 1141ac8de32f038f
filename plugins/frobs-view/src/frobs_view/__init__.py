"""Look at robots, policies and training runs in the browser, with any simulator.

server.py    the web server: who may connect
gate.py      the proxy that checks every connection
devices.py   keys and gamepads of the people who look at a page
shapes.py    triangles of the shapes that are drawn
drawing.py   a robot and a scene in the browser
viewer.py    the viewer of an environment
overlays.py  goal, contacts, trail, curves and camera pictures
player.py    plays policies in a viewed environment
teleop.py    policies through which a person acts
limbs.py     the wish of a person as the action of a controller
robot.py     the page of a robot file
following.py the newest policy of a run that is being trained
page.py      static pages, on which physics and policy run in the browser
cli/         the command
"""

from typing import TYPE_CHECKING

from frobs_cli.lazy_names import lazy_names

if TYPE_CHECKING:
    from frobs_view.devices import Devices as Devices
    from frobs_view.page import write_page as write_page
    from frobs_view.player import Player as Player
    from frobs_view.robot import RobotPage as RobotPage
    from frobs_view.server import ViewServer as ViewServer
    from frobs_view.teleop import GamepadTeleop as GamepadTeleop
    from frobs_view.teleop import KeyboardTeleop as KeyboardTeleop
    from frobs_view.teleop import Teleop as Teleop
    from frobs_view.viewer import BrowserViewer as BrowserViewer

__all__, __getattr__ = lazy_names(__name__, __file__)
