"""Blender's materials as glTF's: a table of shader nodes, and a word on what is not carried over."""

import math

import numpy

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
    "BSDF_GLOSSY": {"color": "Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_METALLIC": {"color": "Base Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_DIFFUSE": {"color": "Color", "roughness": 1.0},
    "BSDF_TRANSPARENT": {"color": 0.0, "roughness": 1.0, "alpha": 0.0},
    "EMISSION": {"color": 0.0, "roughness": 1.0, "emission": "Color", "emission_strength": "Strength"},
}
NODES["BSDF_REFRACTION"] = NODES["BSDF_GLASS"]
# Of any other.
MATTE = {"color": "Color", "roughness": 1.0}

# Sockets that have no place in glTF or in the program, and do nothing at 0.
IGNORED = ("Subsurface Weight", "Sheen Weight", "Anisotropic", "Anisotropy", "Thin Film Thickness")

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


def output(block):
    """The output node of a material, lamp or world that renders take; None without nodes."""
    tree = block.node_tree if getattr(block, "use_nodes", True) else None
    return tree and (tree.get_output_node("CYCLES") or tree.get_output_node("ALL"))


def number(value):
    """A socket's value without its alpha: three numbers or one."""
    return float(value) if isinstance(value, (int, float)) else tuple(value)[:3]


class Surface:
    """A material read into the properties of the table."""

    def __init__(self, material):
        self.material, self.faults = material, []
        self.fault = self.faults.append
        self.node = self.volume_node = self.colour_socket = self.colour_fault = None
        self.values = dict(DEFAULTS, color=tuple(material.diffuse_color)[:3], roughness=1.0)
        # Image texture nodes by property.
        self.images = {}
        end = output(material)
        if end is not None:
            self.volume_node, _ = source(end.inputs["Volume"])
            self.read(source(end.inputs["Surface"])[0])

    def read(self, node):
        """Reads a shader node, if there is one, into `values`."""
        if node is None:
            return
        if node.type in {"MIX_SHADER", "ADD_SHADER"}:
            (self.mix if node.type == "MIX_SHADER" else self.add)(node)
            return
        self.node, self.values, self.colour_socket = node, dict(DEFAULTS), None
        for name, what in NODES.get(node.type, MATTE).items():
            if not isinstance(what, str):
                self.values[name] = (what,) * 3 if name == "color" else what
            elif what in node.inputs:
                self.values[name] = self.value(name, node.inputs[what])
                self.colour_socket = node.inputs[what] if name == "color" else self.colour_socket
        if node.type not in NODES:
            self.fault(f"its {node.bl_label} was read as matte: no light goes through")
        if node.type == "BSDF_REFRACTION":
            self.fault("its Refraction BSDF was read as glass, which reflects as well")
        if node.type == "BSDF_METALLIC" and node.fresnel_type == "PHYSICAL_CONDUCTOR":
            n, k = (numpy.array(node.inputs[name].default_value) for name in ("IOR", "Extinction"))
            self.values["color"] = tuple(((n - 1.0) ** 2 + k * k) / ((n + 1.0) ** 2 + k * k))
        for name in IGNORED:
            if name in node.inputs and (node.inputs[name].is_linked or node.inputs[name].default_value != 0.0):
                self.fault(f"its {name} was ignored")

    def value(self, name, socket):
        """A constant, or what stands for one beside an image."""
        node, origin = source(socket)
        if node is None:
            return None if name == "normal" else number(socket.default_value)
        if node.type in {"RGB", "VALUE"}:
            value = number(origin.default_value)
            return value if isinstance(value, tuple) == isinstance(DEFAULTS[name], tuple) else DEFAULTS[name]
        # Factors beside images that are kept; other images give their mean.
        beside = {"color": (1.0, 1.0, 1.0), "emission": (1.0, 1.0, 1.0), "alpha": 1.0, "normal": 1.0}
        if name == "normal" and node.type == "NORMAL_MAP":
            beside["normal"] = node.inputs["Strength"].default_value
            node, origin = source(node.inputs["Color"])
        outcome = "was ignored" if name == "normal" else "default was baked"
        if node is None or node.type != "TEX_IMAGE" or node.image is None:
            self.fault(f"the nodes at its {socket.name} are not read; its {outcome}")
            self.colour_fault = self.faults[-1] if name == "color" else self.colour_fault
        elif not node.image.size[0] or node.image.source == "TILED":
            self.fault(f"the image {node.image.name} at its {socket.name} is missing or tiled; its {outcome}")
        elif name in beside:
            self.images[name] = node
            return beside[name]
        else:
            pixels = numpy.empty(len(node.image.pixels), dtype=numpy.float32)
            node.image.pixels.foreach_get(pixels)
            colour, alpha = numpy.split(pixels.reshape(-1, node.image.channels), [3], axis=1)
            return float((alpha if origin.name == "Alpha" and alpha.size else colour).mean())
        return DEFAULTS[name]

    def mix(self, node):
        """One of two shaders, or a shader that covers in part."""
        factor, *shaders = node.inputs
        shaders = [source(socket)[0] for socket in shaders]
        by, origin = source(factor)
        is_clear = [shader is None or shader.type == "BSDF_TRANSPARENT" for shader in shaders]
        if by is not None and by.type == "LIGHT_PATH":
            # A common way to let shadows of glass be light: the glass itself is what we need.
            self.read(shaders[is_clear[0]])
            return
        is_constant = by is None or by.type == "VALUE"
        share = number((factor if by is None else origin).default_value) if is_constant else factor.default_value
        covers = is_clear[0] != is_clear[1]
        self.read(shaders[is_clear[0] if covers else share > 0.5])
        if covers and is_constant:
            self.values["alpha"] *= share if is_clear[0] else 1.0 - share
        elif covers and by.type == "TEX_IMAGE" and is_clear[0] and origin.name == "Alpha":
            self.images["alpha"] = by
        elif covers:
            self.fault("the nodes that mix it with a Transparent BSDF are not read; it was baked opaque")
        elif not is_constant or 0.0 < share < 1.0:
            self.fault("its Mix Shader was read as the shader with the greater share")

    def add(self, node):
        """A shader and what it emits."""
        parts = [source(socket)[0] for socket in node.inputs]
        first, *second = sorted(filter(None, parts), key=lambda part: part.type == "EMISSION") or [None]
        self.read(first)
        if second and second[0].type == "EMISSION" and first.type != "EMISSION":
            for name in ("emission", "emission_strength"):
                self.values[name] = self.value(name, second[0].inputs[NODES["EMISSION"][name]])
        elif second:
            self.fault("its Add Shader was read as its first shader")

    def absorption(self):
        """What its volume adds to KHR_materials_volume."""
        node = self.volume_node
        if node is None:
            return {}
        if node.type != "VOLUME_ABSORPTION":
            self.fault(f"its volume, a {node.bl_label}, is not read; it was baked as clear")
            return {}
        color, density = node.inputs["Color"], node.inputs["Density"]
        if color.is_linked or density.is_linked:
            self.fault("the nodes at its volume are not read; their defaults were baked")
        if density.default_value <= 0.0:
            return {}
        # Cycles' coefficient is density · (1 − colour).
        left = [math.exp(unit(channel) - 1.0) for channel in number(color.default_value)]
        return {"attenuationDistance": 1.0 / density.default_value, "attenuationColor": left}

    def is_matte(self):
        """Whether only its light map shows its colour, since no caustic leaves it."""
        values = self.values
        passes_light = max(values["metallic"], values["transmission"]) >= 0.5 or values["coat"] > 0.0
        return values["roughness"] > 0.3 and not passes_light

    def diffuse_share(self):
        """What part of its base colour reflects diffusely; metals do where the program takes them for matte."""
        metallic = self.values["metallic"] if self.values["roughness"] <= MATTE_METAL else 0.0
        return (1.0 - metallic) * (1.0 - self.values["transmission"])

    def gltf(self, texture):
        """The glTF material. `texture(node)` gives the texture info of an image node."""
        values, images, own = self.values, self.images, self.material.nephroid
        transmission, color = values["transmission"], [unit(channel) for channel in values["color"]]
        if self.node is not None and self.node.type == "BSDF_PRINCIPLED" and transmission >= 0.5:
            # Light crosses twice, and Cycles gives each crossing the root.
            color = [math.sqrt(channel) for channel in color]

        pbr = {"baseColorFactor": [*color, unit(values["alpha"])], "metallicFactor": unit(values["metallic"]),
               "roughnessFactor": unit(values["roughness"])}
        extensions = {"KHR_materials_ior": {"ior": max(values["ior"], 1.0)}}
        extras = custom_properties(self.material)
        result = {"name": self.material.name_full, "pbrMetallicRoughness": pbr, "doubleSided": True,
                  "extensions": extensions, "extras": extras}

        # glTF keeps alpha in the image of the colour: one from another image has no place.
        if "color" in images:
            pbr["baseColorTexture"] = texture(images["color"])
        same = "alpha" in images and "color" in images and images["alpha"].image == images["color"].image
        if "alpha" in images and not same:
            self.fault("its alpha comes from another image than its colour; it was baked opaque")
        if same or values["alpha"] < 1.0:
            result["alphaMode"] = "BLEND"
        if "normal" in images and values["normal"]:
            result["normalTexture"] = dict(texture(images["normal"]), scale=values["normal"])

        # A thickness above 0 makes a solid body, which absorbs light along the way; 0 is a thin wall.
        if transmission > 0.0:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": unit(transmission)}
            extensions["KHR_materials_volume"] = {"thicknessFactor": 0.0 if own.is_thin else 1.0, **self.absorption()}

        # The specular level of Principled is 0.5 where glTF's factor is 1: at the reflectance of the index.
        if values["specular"] != 0.5 and transmission == 0.0:
            extensions["KHR_materials_specular"] = {"specularFactor": unit(2.0 * values["specular"])}
        if values["coat"] > 0.0:
            if abs(values["coat_ior"] - 1.5) > 0.01:
                self.fault("its coat was read with an index of 1.5")
            extensions["KHR_materials_clearcoat"] = {"clearcoatFactor": unit(values["coat"]),
                                                     "clearcoatRoughnessFactor": unit(values["coat_roughness"])}

        # Emission is a radiance in Blender; glTF states a colour of at most 1 and cd/m².
        brightest = max(values["emission"]) * values["emission_strength"]
        if brightest > 0.0:
            result["emissiveFactor"] = [unit(channel / max(values["emission"])) for channel in values["emission"]]
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": brightest * LUMENS_PER_WATT}
            if "emission" in images:
                result["emissiveTexture"] = texture(images["emission"])

        # Names of glasses and metals have no extension of glTF, and go into extras.
        if own.glass:
            extras["glass"] = own.glass
        if own.metal != "NONE":
            extras["metal"] = own.metal.lower()
        return result


def unit(value):
    """A value within 0 and 1."""
    return min(max(float(value), 0.0), 1.0)


def custom_properties(owner):
    """What a user stated in custom properties, which win over everything."""
    return {key: value for key, value in owner.items() if isinstance(value, (str, int, float))}
