"""What Mitsuba 3 has no plugin for: recovered lights, and the modified Phong BRDF.

Written by lobelia beside the scenes that need it; render.py imports it. Needs a JIT variant
(llvm_ad_rgb, cuda_ad_rgb): the lights are tables that a scalar variant cannot look up.
"""
import json
import os

import drjit as dr
import mitsuba as mi
import numpy as np

# Part of the choices that is even among all lights.
EVEN = 0.15


class Lights(mi.Emitter):
    """All recovered lights, and added ones without extent: lights.json beside this file.

    A light is one direction with the irradiance of a surface that faces it, as the joint solve
    takes it; its extent matters to what is in the way. So the direction that is tried is one to
    the light's disc, and the irradiance that of its middle. No path can meet such a light.
    """

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        self.m_flags = +mi.EmitterFlags.DeltaPosition
        folder = os.path.dirname(os.path.abspath(__file__))
        with open(os.path.join(folder, "lights.json"), encoding="utf-8") as file:
            table = json.load(file)
        rows = [row for row in table["lights"] if row["set"] == props["set"]]
        self.far = float(table["far_m"])
        # The box that stands for the unmodelled room must not hide the sun.
        self.shell = table["shell"] if props["set"] == "added" else None
        count = len(rows)

        def column(values, width):
            return np.asarray(values, np.float32).reshape(count, width).ravel()

        def numbers(name, width):
            return mi.Float(column([row[name] for row in rows], width))

        self.position = numbers("position", 3)
        self.normal = numbers("normal", 3)
        self.radius = numbers("radius_m", 1)
        self.area = numbers("area", 1)
        self.cos_half = numbers("cos_half_angle", 1)
        self.cone = numbers("cone", 2)
        self.is_distant = mi.Float([float(row["kind"] == "distant") for row in rows])
        self.is_lamp = mi.Float([float(row["kind"] == "lamp") for row in rows])
        self.is_panel = mi.Float([float(row["kind"] == "panel") for row in rows])
        self.is_ball = mi.Float([float(row["kind"] == "ball") for row in rows])
        self.has_panels = any(row["kind"] == "panel" for row in rows)
        self.has_balls = any(row["kind"] == "ball" for row in rows)
        self.corners = numbers("corners", 12)
        self.most = max(len(row["lobes"]) for row in rows)
        lobes = np.zeros((count, self.most, 7), np.float32)
        for k, row in enumerate(rows):
            lobes[k, : len(row["lobes"])] = row["lobes"]
        self.lobes = mi.Float(lobes.ravel())
        self.choice = mi.DiscreteDistribution(self.chances(rows, table["middle"]))

    @staticmethod
    def chances(rows, middle):
        """How likely each light is asked: by what it sends to the middle of the scene."""
        strengths = []
        for row in rows:
            to = np.subtract(row["position"], middle)
            distance = np.linalg.norm(to)
            towards = -np.array(row["normal"]) if row["kind"] == "distant" else to / distance
            factor = row["area"] if row["kind"] == "distant" else row["area"] / distance**2
            sent = 0.0
            for x, y, z, exponent, *emission in row["lobes"]:
                along = max(-np.dot(towards, (x, y, z)), 0.0)
                sent += sum(emission) * (1.0 if exponent == 0 else along**exponent)
            strengths.append(factor * sent)
        strengths = np.array(strengths)
        total = strengths.sum()
        even = np.full(len(rows), 1.0 / len(rows))
        share = strengths / total if total > 0 else even
        return [float(value) for value in EVEN * even + (1 - EVEN) * share]

    def sample_direction(self, it, sample, active=True):
        i, u, chance = self.choice.sample_reuse_pmf(sample.x, active)
        square = mi.Point2f(u, sample.y)

        def number(table):
            return dr.gather(mi.Float, table, i, active)

        def vector(table, stride=3, offset=0):
            return mi.Vector3f(
                *[dr.gather(mi.Float, table, i * stride + offset + k, active) for k in range(3)]
            )

        def before_the_shell(direction):
            if self.shell is None:
                return self.far
            low, high = [mi.Vector3f(*end) for end in self.shell]
            ends = dr.select(direction > 0, high, low) - mi.Vector3f(it.p)
            return 0.999 * dr.min(dr.select(direction == 0, self.far, ends / direction))

        middle, normal, radius = vector(self.position), vector(self.normal), number(self.radius)
        distant, lamp = number(self.is_distant) > 0, number(self.is_lamp) > 0
        offset = middle - mi.Vector3f(it.p)
        distance = dr.norm(offset)
        towards = dr.select(distant, -normal, offset / distance)
        factor = number(self.area) * dr.select(
            distant, 1.0, dr.rcp(dr.square(dr.maximum(distance, 0.5 * radius)))
        )
        # Where on the light: a disc, or a cone of directions.
        frame = mi.Frame3f(dr.select(lamp | distant, towards, normal))
        disc = mi.warp.square_to_uniform_disk_concentric(square) * radius
        cone = mi.warp.square_to_uniform_cone(square, number(self.cos_half))
        away = frame.to_world(cone)
        target = dr.select(
            distant,
            mi.Vector3f(it.p) + away * before_the_shell(away),
            middle + frame.s * disc.x + frame.t * disc.y,
        )
        cos_middle = dr.dot(it.n, towards)
        offset = target - mi.Vector3f(it.p)
        distance = dr.norm(offset)
        direction = offset / distance
        # The integrator multiplies by the cosine of the direction; that of the middle is due.
        factor *= cos_middle / dr.dot(it.n, direction)

        if self.has_panels:
            a, b, c, d = [vector(self.corners, 12, 3 * k) for k in range(4)]
            first = square.x > square.y
            at = dr.select(
                first,
                a + square.x * (b - a) + square.y * (c - b),
                a + square.y * (d - a) + square.x * (c - d),
            )
            size = dr.norm(dr.cross(dr.select(first, b, c) - a, dr.select(first, c, d) - a))
            away = at - mi.Vector3f(it.p)
            reach = dr.norm(away)
            shines = dr.maximum(-dr.dot(away, normal) / reach, 0.0)
            panel = number(self.is_panel) > 0
            target = dr.select(panel, at, target)
            distance = dr.select(panel, reach, distance)
            direction = dr.select(panel, away / reach, direction)
            factor = dr.select(panel, size * shines / dr.square(reach), factor)
        if self.has_balls:
            away = middle - mi.Vector3f(it.p)
            reach = dr.norm(away)
            sine_squared = dr.minimum(dr.square(radius / reach), 1.0)
            cos_half = dr.safe_sqrt(1 - sine_squared)
            local = mi.warp.square_to_uniform_cone(square, cos_half)
            off = dr.square(reach) * (1 - dr.square(local.z))
            entry = reach * local.z - dr.safe_sqrt(dr.square(radius) - off)
            way = mi.Frame3f(away / reach).to_world(local)
            ball = number(self.is_ball) > 0
            target = dr.select(ball, mi.Vector3f(it.p) + way * entry, target)
            distance = dr.select(ball, entry, distance)
            direction = dr.select(ball, way, direction)
            solid_angle = dr.two_pi * sine_squared / (1 + cos_half)
            factor = dr.select(ball, solid_angle, factor)

        light = mi.Color3f(0.0)
        for k in range(self.most):
            first = 7 * k
            stride = 7 * self.most
            axis = vector(self.lobes, stride, first)
            exponent = dr.gather(mi.Float, self.lobes, i * stride + first + 3, active)
            emission = mi.Color3f(vector(self.lobes, stride, first + 4))
            along = dr.maximum(-dr.dot(towards, axis), 0.0)
            light += emission * dr.select(exponent == 0, 1.0, dr.power(along, exponent))
        # A spot's cone: full within, none without, smooth in between; others have (-2, -3).
        full = dr.gather(mi.Float, self.cone, 2 * i, active)
        none = dr.gather(mi.Float, self.cone, 2 * i + 1, active)
        t = dr.clip((-dr.dot(towards, normal) - none) / (full - none), 0.0, 1.0)
        light *= t * t * (3 - 2 * t)

        active = active & (factor > 0) & dr.isfinite(factor)
        ds = dr.zeros(mi.DirectionSample3f, dr.width(it.p))
        ds.p = mi.Point3f(target)
        ds.n = mi.Normal3f(-direction)
        ds.time = it.time
        ds.d = direction
        ds.dist = distance
        ds.pdf = dr.select(active, chance, 0.0)
        ds.delta = mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        return ds, mi.Color3f(dr.select(active, light * factor / chance, 0.0))

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0.0)

    def eval_direction(self, it, ds, active=True):
        return mi.Color3f(0.0)

    def eval(self, si, active=True):
        return mi.Color3f(0.0)

    def bbox(self):
        return mi.ScalarBoundingBox3f()

    def traverse(self, callback):
        pass

    def to_string(self):
        return "LobeliaLights[]"


class Phong(mi.BSDF):
    """rho_d / pi + rho_s (n + 2) / (2 pi) cos^n on both sides (Lafortune and Willems 1994)."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [
            mi.BSDFFlags.DiffuseReflection | sides | mi.BSDFFlags.SpatiallyVarying,
            mi.BSDFFlags.GlossyReflection | sides,
        ]
        self.m_flags = self.m_components[0] | self.m_components[1]
        diffuse = props["diffuse"]
        self.texture = diffuse if isinstance(diffuse, mi.Texture) else None
        self.colour = mi.Color3f(0.0 if self.texture else diffuse)
        self.specular = mi.Color3f(*[float(props["specular_" + c]) for c in "rgb"])
        self.exponent = mi.Float(props["exponent"])

    def diffuse(self, si, active):
        return self.colour if self.texture is None else mi.Color3f(self.texture.eval(si, active))

    def parts(self, si, wo, active):
        """Reflectance times cosine, and density, above the surface."""
        side = dr.sign(si.wi.z)
        wi, wo = side * si.wi, side * wo
        diffuse = self.diffuse(si, active)
        along = dr.maximum(dr.dot(mi.Vector3f(-wi.x, -wi.y, wi.z), wo), 0.0)
        power = dr.power(along, self.exponent)
        active = active & (wi.z > 0) & (wo.z > 0)
        value = dr.inv_pi * (diffuse + self.specular * (0.5 * (self.exponent + 2) * power))
        part = self.specular_part(diffuse)
        density = dr.inv_pi * (
            (1 - part) * wo.z + part * 0.5 * (self.exponent + 1) * power
        )
        return dr.select(active, value * wo.z, 0.0), dr.select(active, density, 0.0)

    def specular_part(self, diffuse):
        shine = dr.sum(self.specular)
        return dr.select(shine > 0, shine / (shine + dr.sum(diffuse)), 0.0)

    def eval(self, ctx, si, wo, active=True):
        return self.parts(si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.parts(si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.parts(si, wo, active)

    def sample(self, ctx, si, sample1, sample2, active=True):
        side = dr.sign(si.wi.z)
        part = self.specular_part(self.diffuse(si, active))
        glossy = sample1 < part
        height = dr.power(sample2.x, dr.rcp(self.exponent + 1))
        across = dr.safe_sqrt(1 - height * height)
        sine, cosine = dr.sincos(dr.two_pi * sample2.y)
        mirror = mi.Frame3f(side * mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
        lobe = mirror.to_world(mi.Vector3f(across * cosine, across * sine, height))
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = side * dr.select(glossy, lobe, mi.warp.square_to_cosine_hemisphere(sample2))
        value, bs.pdf = self.parts(si, bs.wo, active)
        bs.eta = 1.0
        kinds = [+mi.BSDFFlags.DiffuseReflection, +mi.BSDFFlags.GlossyReflection]
        bs.sampled_type = dr.select(glossy, mi.UInt32(kinds[1]), mi.UInt32(kinds[0]))
        bs.sampled_component = dr.select(glossy, mi.UInt32(1), mi.UInt32(0))
        return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0.0)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "LobeliaPhong[]"


class BehindTheRoom(mi.SamplingIntegrator):
    """A path tracer whose camera does not see the grey box that stands for the unmodelled room."""

    def __init__(self, props):
        mi.SamplingIntegrator.__init__(self, props)
        self.low, self.high = [
            mi.Vector3f(*[float(props[end + axis]) for axis in "xyz"]) for end in ("low_", "high_")
        ]
        self.margin = 1e-4 * dr.norm(self.high - self.low)
        self.path = mi.load_dict({"type": "path", "max_depth": props["max_depth"]})

    def sample(self, scene, sampler, ray, medium=None, active=True):
        si = scene.ray_intersect(mi.Ray3f(ray), active)
        place = mi.Vector3f(si.p)
        inside = dr.all((place > self.low + self.margin) & (place < self.high - self.margin))
        seen = active & (inside | ~si.is_valid())
        light, valid, aovs = self.path.sample(scene, sampler, ray, medium, seen)
        return dr.select(seen, light, 0.0), valid & seen, aovs

    def aov_names(self):
        return []

    def to_string(self):
        return "BehindTheRoom[]"


mi.register_emitter("lobelia_lights", Lights)
mi.register_bsdf("lobelia_phong", Phong)
mi.register_integrator("lobelia_path", BehindTheRoom)
