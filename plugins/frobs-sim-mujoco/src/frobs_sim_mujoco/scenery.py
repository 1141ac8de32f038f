"""Adds lights, a floor, bodies and cameras to a MuJoCo model."""

from __future__ import annotations

import mujoco
import numpy as np

from frobs_core.description import Attachment, Body, Camera, Scene
from frobs_core.models import Pose
from frobs_core.util.errors import SceneError
from frobs_sim_mujoco.articulation import HARD, set_inertia
from frobs_sim_mujoco.geoms import SCENE_GROUP, VISUAL_GROUP, add_shape, make_hard
from frobs_sim_mujoco.meshes import Meshes

_FAR = 8.0  # [m] viewing distance beyond which small floor squares would flicker
SKY = (0.86, 0.91, 0.96), (0.55, 0.65, 0.76)
"""Colors of the sky above and at the horizon."""
_PIXEL = 1e-5  # [m] size of a camera's pixels, which does not affect images


def light_up(spec: mujoco.MjSpec) -> None:
    """Add a sky and soft light, and enlarge the framebuffer for rendering."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=SKY[0],
        rgb2=SKY[1],
        width=64,
        height=384,
    )
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1440
    spec.visual.quality.shadowsize = 4096
    spec.visual.map.shadowclip = 2.0  # multiple of the scene's extent; larger values make shadows noisy
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.visual.headlight.diffuse = (0.35, 0.35, 0.35)
    spec.visual.headlight.specular = (0.05, 0.05, 0.05)
    spec.worldbody.add_light(
        pos=(1.5, -1.5, 3.5),
        dir=(-0.38, 0.38, -0.85),
        diffuse=(0.6, 0.6, 0.6),
        specular=(0.15, 0.15, 0.15),
        castshadow=True,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
    )


def show_far(model: mujoco.MjModel, scene: Scene) -> None:
    """Increase the model's maximum viewing distance, so that even distant cameras can see the floor.

    By default, the maximum viewing distance depends on the size of the bodies.
    """
    model.vis.map.zfar = max(model.vis.map.zfar, 3.0 * scene.span / model.stat.extent)


def add_floor(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add an infinite checkered plane at z = 0."""
    repeat = 4.0 if scene.span < _FAR else 0.5  # repetitions per meter of a pattern of two by two squares
    spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=(0.78, 0.80, 0.82),
        rgb2=(0.72, 0.74, 0.77),
        width=512,
        height=512,
    )
    material = spec.add_material(name="floor", texrepeat=(repeat, repeat), texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0, 0, 0.05),
        material="floor",
        group=SCENE_GROUP,
        friction=(scene.floor_friction, 0.0, 0.0),
    )


def add_body(spec: mujoco.MjSpec, meshes: Meshes, name: str, body: Body, *, hard: bool) -> None:
    """Add a body of the scene, with hard or soft contacts."""
    element = spec.worldbody.add_body(name=name, pos=body.pose.pos, quat=body.pose.quat_wxyz, mocap=body.kinematic)
    if body.inertial is not None:
        element.add_freejoint(name=name)
        element.explicitinertial = True
        set_inertia(element, body.inertial)
    for part in body.parts:
        group = SCENE_GROUP if part.collides else VISUAL_GROUP
        for geom in add_shape(meshes, element, part.geometry, part.pose, group, part.rgba, collides=part.collides):
            geom.mass = 0.0
            geom.friction = (body.friction, body.torsional_friction, body.rolling_friction)
            if hard:
                make_hard(spec, geom)
            if body.rolling_friction > 0.0:
                geom.condim = 6
            elif body.torsional_friction > 0.0:
                geom.condim = 4


def add_attachment(spec: mujoco.MjSpec, name: str, attachment: Attachment, pose: Pose) -> None:
    """Weld two bodies together, with ``pose`` as the second body's pose in the first body's frame.

    Raises:
        ConfigurationError: One of the attached links is not a MuJoCo body.
    """
    for side in (attachment.first, attachment.second):
        if spec.body(side) is None:  # for example, a link between two joints of the same MJCF body
            raise SceneError(f"attachment '{name}'", f"refers to '{side}', which is not a body in the scene.")
    anchor, torque_scale = (0.0, 0.0, 0.0), 1.0
    data = [*anchor, *pose.pos, *pose.quat_wxyz, torque_scale, 0.0]
    spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1=attachment.first,
        name2=attachment.second,
        data=data,
        solref=(2.0 * spec.option.timestep, 1.0),
        solimp=HARD,
    )
    spec.add_exclude(bodyname1=attachment.first, bodyname2=attachment.second)


def add_camera(spec: mujoco.MjSpec, name: str, camera: Camera) -> None:
    """Add a camera.

    Raises:
        ConfigurationError: The camera is fixed to an object that is not a MuJoCo body.
    """
    parent = spec.worldbody if camera.frame is None else spec.body(camera.frame)
    if parent is None:  # links between joints of one MJCF body are not MuJoCo bodies
        raise SceneError(f"camera '{name}'", f"is fixed to '{camera.frame}', which is not a body in the scene.")
    back = np.subtract(camera.pos, camera.target)
    back = back / np.linalg.norm(back)
    up = camera.up or ((0.0, 1.0, 0.0) if abs(back[2]) > 0.999 else (0.0, 0.0, 1.0))
    right = np.cross(np.array(up), back)
    right /= np.linalg.norm(right)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.stack([right, np.cross(back, right), back], axis=1).reshape(9))
    added = parent.add_camera(name=name, pos=camera.pos, quat=quat, fovy=camera.fov_y)
    if camera.intrinsics is not None:
        lens = camera.intrinsics
        added.resolution = [lens.width, lens.height]
        added.sensor_size = [lens.width * _PIXEL, lens.height * _PIXEL]
        added.focal_pixel = [lens.fx, lens.fy]
        added.principal_pixel = [(lens.width - 1) / 2 - lens.cx, (lens.height - 1) / 2 - lens.cy]
