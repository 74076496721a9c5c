"""Blender's materials as glTF's: a table of shader nodes, and a word on what is not carried over."""

import math

LUMENS_PER_WATT = 683.0
# Roughness above which the program takes a metal for matte.
MATTE_METAL = 0.6

# What each shader node is in glTF. A text names a socket of the node; a number is that value.
NODES = {
    "BSDF_PRINCIPLED": {
        "color": "Base Color", "metallic": "Metallic", "roughness": "Roughness", "ior": "IOR", "alpha": "Alpha",
        "transmission": "Transmission Weight", "specular": "Specular IOR Level", "coat": "Coat Weight",
        "coat_roughness": "Coat Roughness", "coat_ior": "Coat IOR", "normal": "Normal",
        "emission": "Emission Color", "emission_strength": "Emission Strength",
    },
    "BSDF_GLASS": {"color": "Color", "roughness": "Roughness", "ior": "IOR", "transmission": 1.0, "normal": "Normal"},
    "BSDF_REFRACTION": {"color": "Color", "roughness": "Roughness", "ior": "IOR", "transmission": 1.0, "normal": "Normal"},
    "BSDF_GLOSSY": {"color": "Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_METALLIC": {"color": "Base Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_DIFFUSE": {"color": "Color", "roughness": 1.0},
    "BSDF_TRANSPARENT": {"color": 0.0, "roughness": 1.0, "alpha": 0.0},
    "EMISSION": {"color": 0.0, "roughness": 1.0, "emission": "Color", "emission_strength": "Strength"},
    # Matte, with a word about it.
    "BSDF_TRANSLUCENT": {"color": "Color", "roughness": 1.0},
    "BSDF_SHEEN": {"color": "Color", "roughness": 1.0},
    "BSDF_TOON": {"color": "Color", "roughness": 1.0},
    "SUBSURFACE_SCATTERING": {"color": "Color", "roughness": 1.0},
}

READ_AS = {
    "BSDF_REFRACTION": "glass, which reflects as well",
    "BSDF_TRANSLUCENT": "matte: no light goes through",
    "BSDF_SHEEN": "matte",
    "BSDF_TOON": "matte",
    "SUBSURFACE_SCATTERING": "matte: no light goes through",
}

# Sockets that have no place in glTF or in the program, and the value at which they do nothing.
IGNORED = {
    "Subsurface Weight": 0.0, "Sheen Weight": 0.0, "Anisotropic": 0.0, "Anisotropy": 0.0, "Thin Film Thickness": 0.0,
}

DEFAULTS = {
    "color": (0.8, 0.8, 0.8), "metallic": 0.0, "roughness": 0.5, "ior": 1.5, "alpha": 1.0, "transmission": 0.0,
    "specular": 0.5, "coat": 0.0, "coat_roughness": 0.0, "coat_ior": 1.5, "emission": (0.0, 0.0, 0.0),
    "emission_strength": 0.0, "normal": None,
}

LIGHT_MAP_GROUP = "Nephroid light map"


def source(socket):
    """The node and socket that feed a socket, past reroutes and our own light maps; (None, None) without any."""
    while socket is not None and socket.is_linked:
        link = socket.links[0]
        node = link.from_node
        if node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree and node.node_tree.name == LIGHT_MAP_GROUP:
            socket = node.inputs["Shader"]
        else:
            return node, link.from_socket
    return None, None


def nodes_of(block):
    """The node tree of a material, lamp or world that uses one."""
    return block.node_tree if getattr(block, "use_nodes", True) else None


def output(block):
    """The output node that renders take; None without nodes."""
    tree = nodes_of(block)
    return tree and (tree.get_output_node("CYCLES") or tree.get_output_node("ALL"))


def number(value):
    """A socket's value without its alpha: three numbers or one."""
    return float(value) if isinstance(value, (int, float)) else tuple(value)[:3]


class Surface:
    """A material read into the properties of the table."""

    def __init__(self, material):
        self.material, self.faults = material, []
        self.node = None
        self.values = dict(DEFAULTS, color=tuple(material.diffuse_color)[:3], roughness=1.0)
        # Image texture nodes by property.
        self.images = {}
        end = output(material)
        if end is None:
            return
        node, _ = source(end.inputs["Surface"])
        if node is not None:
            self.read(node)
        self.volume_node, _ = source(end.inputs["Volume"])

    volume_node = None
    has_unread_colour = False

    def fault(self, text):
        if text not in self.faults:
            self.faults.append(text)

    def read(self, node):
        """Reads a shader node into `values`."""
        if node.type == "MIX_SHADER":
            return self.mix(node)
        if node.type == "ADD_SHADER":
            return self.add(node)
        row = NODES.get(node.type)
        if row is None:
            self.fault(f"its shader {node.bl_label} is not read; it was baked as matte")
            return
        self.node = node
        self.values = dict(DEFAULTS)
        for name, what in row.items():
            if isinstance(what, str):
                socket = node.inputs.get(what)
                if socket is not None:
                    self.values[name] = self.value(name, socket)
            else:
                self.values[name] = (what,) * 3 if name == "color" else what
        if node.type in READ_AS:
            self.fault(f"its {node.bl_label} was read as {READ_AS[node.type]}")
        for name, neutral in IGNORED.items():
            socket = node.inputs.get(name)
            if socket is not None and (socket.is_linked or abs(socket.default_value - neutral) > 1e-6):
                self.fault(f"its {name} was ignored")
        if node.type == "BSDF_METALLIC" and node.fresnel_type == "PHYSICAL_CONDUCTOR":
            self.values["color"] = conductor(number(node.inputs["IOR"].default_value),
                                             number(node.inputs["Extinction"].default_value))

    def value(self, name, socket):
        """A constant, or what stands for one beside an image."""
        node, origin = source(socket)
        if node is None:
            return number(socket.default_value) if hasattr(socket, "default_value") and name != "normal" else None
        if node.type in {"RGB", "VALUE"}:
            value = number(origin.default_value)
            return value if isinstance(value, tuple) == isinstance(DEFAULTS[name], tuple) else DEFAULTS[name]
        strength = 1.0
        if name == "normal" and node.type == "NORMAL_MAP":
            strength = node.inputs["Strength"].default_value
            node, origin = source(node.inputs["Color"])
        if node is not None and node.type == "TEX_IMAGE" and node.image is not None:
            self.images[name] = node
            if name in {"color", "emission"}:
                return (1.0, 1.0, 1.0)
            return strength if name == "normal" else self.mean(name, node, origin)
        outcome = "it was ignored" if name == "normal" else "its default was baked"
        self.fault(f"the nodes at its {socket.name} are not read; {outcome}")
        self.has_unread_colour |= name == "color"
        return DEFAULTS[name]

    def mean(self, name, node, origin):
        """Of the image that a factor follows; alpha keeps its image."""
        if name == "alpha":
            return 1.0
        import numpy
        image = node.image
        pixels = numpy.empty(len(image.pixels), dtype=numpy.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(-1, image.channels)
        if not len(pixels):
            return DEFAULTS[name]
        self.images.pop(name)
        return float(pixels[:, 3].mean() if origin.name == "Alpha" and image.channels > 3 else pixels[:, :3].mean())

    def mix(self, node):
        """One of two shaders, or a shader that covers in part."""
        factor, first, second = node.inputs[0], node.inputs[1], node.inputs[2]
        a, b = source(first)[0], source(second)[0]
        by, origin = source(factor)
        is_clear = [shader is None or shader.type == "BSDF_TRANSPARENT" for shader in (a, b)]
        if by is not None and by.type == "LIGHT_PATH":
            # A common way to let shadows of glass be light: the glass itself is what we need.
            chosen = b if is_clear[0] else a
            return self.read(chosen) if chosen else None
        share = number(origin.default_value if by is not None and by.type == "VALUE" else factor.default_value)
        if is_clear[0] != is_clear[1]:
            self.read(b if is_clear[0] else a)
            if by is None or by.type == "VALUE":
                self.values["alpha"] *= share if is_clear[0] else 1.0 - share
            elif by.type == "TEX_IMAGE" and is_clear[0] and origin.name == "Alpha":
                self.images["alpha"] = by
            else:
                self.fault("the nodes that mix it with a Transparent BSDF are not read; it was baked opaque")
            return None
        if by is not None or 0.0 < share < 1.0:
            self.fault("its Mix Shader was read as the shader with the greater share")
        chosen = b if share > 0.5 else a
        return self.read(chosen) if chosen else None

    def add(self, node):
        """A shader and what it emits."""
        parts = [source(socket)[0] for socket in node.inputs]
        parts = sorted((part for part in parts if part is not None), key=lambda part: part.type == "EMISSION")
        if len(parts) == 2 and parts[1].type == "EMISSION" and parts[0].type != "EMISSION":
            self.read(parts[1])
            glow = {name: self.values[name] for name in ("emission", "emission_strength")}
            glow_image = self.images.pop("emission", None)
            self.read(parts[0])
            self.values.update(glow)
            if glow_image is not None:
                self.images["emission"] = glow_image
        elif parts:
            self.read(parts[0])
            if len(parts) == 2:
                self.fault("its Add Shader was read as its first shader")

    def absorption(self):
        """Attenuation distance [m] and colour of its volume; None where that is clear."""
        node = self.volume_node
        if node is None:
            return None
        if node.type == "VOLUME_ABSORPTION":
            color, density = node.inputs["Color"], node.inputs["Density"]
            if source(color)[0] or source(density)[0]:
                self.fault("the nodes at its volume are not read; their defaults were baked")
            # Cycles' coefficient is density · (1 − colour).
            density = max(density.default_value, 0.0)
            left = [math.exp(-(1.0 - min(max(channel, 0.0), 1.0))) for channel in number(color.default_value)]
            return (1.0 / density, left) if density > 0.0 else None
        self.fault(f"its volume, a {node.bl_label}, is not read; it was baked as clear")
        return None

    def is_matte(self):
        """Whether only its light map shows its colour, since no caustic leaves it."""
        values = self.values
        return values["metallic"] < 0.5 and values["transmission"] < 0.5 and values["roughness"] > 0.3 and values["coat"] == 0.0

    def diffuse_share(self):
        """What part of its base colour reflects diffusely; metals do where the program takes them for matte."""
        metallic = self.values["metallic"] if self.values["roughness"] <= MATTE_METAL else 0.0
        return (1.0 - metallic) * (1.0 - self.values["transmission"])

    def gltf(self, texture):
        """The glTF material. `texture(node)` gives the texture info of an image node."""
        values, images, own = self.values, self.images, self.material.nephroid
        transmission, color = values["transmission"], clamped(values["color"])
        if self.node is not None and self.node.type == "BSDF_PRINCIPLED" and transmission >= 0.5:
            # Light crosses twice, and Cycles gives each crossing the root.
            color = [math.sqrt(channel) for channel in color]
        pbr = {"baseColorFactor": [*color, clamped([values["alpha"]])[0]], "metallicFactor": clamped([values["metallic"]])[0],
               "roughnessFactor": clamped([values["roughness"]])[0]}
        extensions = {}
        result = {"name": self.material.name_full, "pbrMetallicRoughness": pbr, "doubleSided": True, "extensions": extensions}
        if "color" in images:
            pbr["baseColorTexture"] = texture(images["color"])
        same = "alpha" in images and "color" in images and images["alpha"].image == images["color"].image
        if "alpha" in images and not same:
            self.fault("its alpha comes from another image than its colour; it was baked opaque")
        if same or values["alpha"] < 1.0:
            result["alphaMode"] = "BLEND"
        if "normal" in images and values["normal"]:
            result["normalTexture"] = dict(texture(images["normal"]), scale=values["normal"])
        if transmission > 0.0:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": clamped([transmission])[0]}
            volume = {"thicknessFactor": 0.0 if own.is_thin else 1.0}
            absorbed = self.absorption()
            if absorbed:
                volume.update(attenuationDistance=absorbed[0], attenuationColor=absorbed[1])
            extensions["KHR_materials_volume"] = volume
        if values["ior"] != 1.5:
            extensions["KHR_materials_ior"] = {"ior": max(values["ior"], 1.0)}
        if values["specular"] != 0.5 and transmission == 0.0:
            extensions["KHR_materials_specular"] = {"specularFactor": clamped([2.0 * values["specular"]])[0]}
        if values["coat"] > 0.0:
            if abs(values["coat_ior"] - 1.5) > 0.01:
                self.fault("its coat was read with an index of 1.5")
            extensions["KHR_materials_clearcoat"] = {"clearcoatFactor": clamped([values["coat"]])[0],
                                                     "clearcoatRoughnessFactor": clamped([values["coat_roughness"]])[0]}
        brightest = max(values["emission"]) * values["emission_strength"]
        if brightest > 0.0:
            result["emissiveFactor"] = clamped([channel / max(values["emission"]) for channel in values["emission"]])
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": brightest * LUMENS_PER_WATT}
            if "emission" in images:
                result["emissiveTexture"] = texture(images["emission"])
        extras = custom_properties(self.material)
        if own.glass:
            extras["glass"] = own.glass
        if own.metal != "NONE":
            extras["metal"] = own.metal.lower()
        if extras:
            result["extras"] = extras
        return result


def clamped(channels):
    """Channels within 0 and 1."""
    return [min(max(float(channel), 0.0), 1.0) for channel in channels]


def conductor(ior, extinction):
    """Reflectance of a metal seen head on."""
    return tuple(((n - 1.0) ** 2 + k * k) / ((n + 1.0) ** 2 + k * k) for n, k in zip(ior, extinction))


def custom_properties(owner):
    """What a user stated in custom properties, which win over everything."""
    return {key: value for key, value in owner.items() if isinstance(value, (str, int, float))}
