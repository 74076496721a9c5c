"""Bakes of the open scene by the program, and its window on the same scene."""

import json
import re
import shutil
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import bpy

from . import lamps, lightmaps
from .scene import Export

NAMES = re.compile(r"(node|light|mesh|material) `([^`]*)`")


def program():
    """Path of the program: the one that the preferences name, else the one that came along, else the one on the path.

    Raises FileNotFoundError where there is none.
    """
    chosen = bpy.context.preferences.addons[__package__].preferences.program
    if chosen:
        return bpy.path.abspath(chosen)
    try:
        import nephroid
        path = nephroid.program()
        path.chmod(path.stat().st_mode | 0o111)
        return str(path)
    except ImportError:
        found = shutil.which("nephroid")
        if found is None:
            raise FileNotFoundError("the program nephroid is not there; name it in the preferences of this add-on") from None
        return found


class Files:
    """A folder of its own with the scene and, where it shines, the world."""

    def __init__(self, context):
        self.folder = Path(tempfile.mkdtemp(prefix="nephroid-", dir=bpy.app.tempdir))
        self.scene, self.world = self.folder / "scene.glb", self.folder / "world.exr"
        self.settings = context.scene.nephroid
        self.has_world = lamps.world_shines(context.scene.world, self.settings.world)
        if self.has_world:
            lamps.write_world(context.scene.world, self.world)
        self.export = Export(context, self.scene, self.settings)

    def options(self):
        """Of the program, for this scene and the settings of the panel."""
        layers = "caustic" if self.settings.layers == "CAUSTIC" else "caustic,direct,indirect"
        options = ["--preset", self.settings.preset.lower(), "--layers", layers,
                   # The file says itself what is solid.
                   "--map-resolution", self.settings.map_size.lower(), "--solid-glass=off"]
        return options + (["--environment", str(self.world)] if self.has_world else [])

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)


def start(*command, **streams):
    """Starts the program without a console window of its own."""
    flags = getattr(subprocess, "CREATE_NO_WINDOW", 0)
    return subprocess.Popen([program(), *map(str, command)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                            creationflags=flags, **streams)


class Job:
    """A bake that runs beside Blender. Nothing in the file changes before `finish`."""

    def __init__(self, context):
        self.files = Files(context)
        self.messages = list(self.files.export.messages)
        self.stage, self.share = "start", 0.0
        self.failed, self.is_cancelled = None, False
        files = self.files
        self.steps = [
            ["bake", files.scene, "-o", files.folder / "maps", "--progress", "json", *files.options()],
            ["export", files.folder / "maps", "--format", "exr", "--bits", "32", "--units", "E/pi",
             "-o", files.folder / "textures"],
        ]
        self.process = None
        try:
            self.next_step()
        except OSError:
            self.files.remove()
            raise

    def next_step(self):
        self.process = start(*self.steps.pop(0), stderr=subprocess.PIPE)
        self.reader = threading.Thread(target=self.listen, args=(self.process.stderr,), daemon=True)
        self.reader.start()

    def listen(self, stream):
        """Progress, warnings and the error, line by line."""
        for line in stream:
            line = line.decode(errors="replace").strip()
            if line.startswith("{"):
                told = json.loads(line)
                self.stage, self.share = told["stage"], told["done"] / max(told["total"], 1)
            elif line.startswith("warning: ") and "so it is a thin pane" not in line:
                self.messages.append((None, line.removeprefix("warning: ")))
            elif line.startswith("error: "):
                # The user knows of no file.
                self.failed = line.removeprefix("error: ").replace(f"{self.files.scene}: ", "")

    def poll(self):
        """Whether it has ended, one way or the other."""
        if self.process.poll() is None:
            return False
        self.reader.join()
        if self.process.returncode != 0:
            self.failed = self.failed or f"the program ended with {self.process.returncode}"
            return True
        manifest = json.loads((self.files.folder / "maps" / "manifest.json").read_text())
        if not manifest["maps"]:
            reasons = [effect["reason"] for effect in manifest["effects"] if not effect["on"]]
            self.failed = f"there is no light to show: {reasons[0] if reasons else 'no surface received any'}"
            return True
        if not self.steps:
            return True
        self.next_step()
        return False

    def cancel(self):
        """Ends it; nothing has been changed."""
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.files.remove()

    def finish(self, context):
        """Puts the maps back; messages as (level, object name or '', text)."""
        found = [message for owner, text in self.messages for message in addressed("WARNING", owner, text)]
        try:
            if self.failed:
                return found + addressed("ERROR", None, self.failed)
            keeps_lamps = self.files.settings.layers == "CAUSTIC"
            count = lightmaps.put_back(context, self.files.export, self.files.folder, keeps_lamps,
                                       lambda name, text: found.append(("WARNING", name, text)))
            return found + [("INFO", "", f"{count} light maps")]
        except (OSError, ValueError, RuntimeError) as error:
            lightmaps.remove(context)
            return found + [("ERROR", "", str(error))]
        finally:
            self.files.remove()


def addressed(level, owner, text):
    """A message for each object that it is about: the one that it names, or those of a material or a mesh."""
    if isinstance(owner, str):
        return [(level, owner, text)]
    named = [owner] if owner else NAMES.findall(text)
    objects = bpy.context.scene.objects
    names = []
    for kind, name in named:
        if kind in {"node", "light"} and name in objects:
            names.append(name)
        elif kind == "material":
            names += [item.name for item in objects if any(slot.material and slot.material.name_full == name
                                                           for slot in item.material_slots)]
        elif kind == "mesh":
            names += [item.name for item in objects if item.name == name or (item.data and item.data.name == name)]
    return [(level, name, text) for name in dict.fromkeys(names)] or [(level, "", text)]


def report(operator, context, messages):
    """Shows messages in Blender's reports and in the panel."""
    shown = context.window_manager.nephroid_messages
    shown.clear()
    for level, name, text in messages:
        operator.report({level}, f"{name}: {text}" if name else text)
        if level != "INFO":
            message = shown.add()
            message.level, message.object, message.text = level, name, text


running = None


class NEPHROID_OT_bake(bpy.types.Operator):
    """Bake the light that glass, mirrors and water throw onto the scene, and show it on the surfaces"""

    bl_idname, bl_label = "nephroid.bake", "Bake Caustics"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return running is None and context.mode == "OBJECT"

    def begin(self, context):
        global running
        try:
            running = Job(context)
        except (OSError, RuntimeError) as error:
            report(self, context, [("ERROR", "", str(error))])
        return running is not None

    def end(self, context):
        global running
        job, running = running, None
        messages = job.finish(context)
        report(self, context, messages)
        return {"CANCELLED"} if messages[-1][0] == "ERROR" else {"FINISHED"}

    def execute(self, context):
        if not self.begin(context):
            return {"CANCELLED"}
        while not running.poll():
            time.sleep(0.05)
        return self.end(context)

    def invoke(self, context, event):
        if not self.begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            running.is_cancelled = True
        if event.type not in {"TIMER", "ESC"}:
            return {"PASS_THROUGH"}
        if not running.is_cancelled and not running.poll():
            context.window_manager.progress_update(round(100 * running.share))
            for area in context.screen.areas if context.screen else ():
                if area.type == "PROPERTIES":
                    area.tag_redraw()
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        return self.stopped(context) if running.is_cancelled else self.end(context)

    def stopped(self, context):
        global running
        running.cancel()
        running = None
        report(self, context, [("INFO", "", "Cancelled: nothing was changed")])
        return {"CANCELLED"}


class NEPHROID_OT_cancel(bpy.types.Operator):
    """End the bake and change nothing"""

    bl_idname, bl_label = "nephroid.cancel", "Cancel"

    @classmethod
    def poll(cls, context):
        return running is not None

    def execute(self, context):
        running.is_cancelled = True
        return {"FINISHED"}


class NEPHROID_OT_remove(bpy.types.Operator):
    """Take all light maps away again: images, coordinates, nodes and modifiers"""

    bl_idname, bl_label = "nephroid.remove", "Remove Light Maps"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return running is None and context.mode == "OBJECT"

    def execute(self, context):
        if not lightmaps.remove(context):
            self.report({"INFO"}, "There are no light maps")
        return {"FINISHED"}


class NEPHROID_OT_select(bpy.types.Operator):
    """Select the object that this is about"""

    bl_idname, bl_label = "nephroid.select", "Select"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty()

    def execute(self, context):
        item = context.view_layer.objects.get(self.name)
        if item is None:
            self.report({"WARNING"}, f"{self.name} is not in this view layer")
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        item.select_set(True)
        context.view_layer.objects.active = item
        return {"FINISHED"}


class LiveView:
    """The program's window, and a scene that is written again whenever it changes."""

    # Between two looks whether something changed [s].
    PERIOD_S = 0.3

    def __init__(self, context):
        self.scene, self.is_changed = context.scene, False
        self.files = Files(context)
        self.process = start("view", self.files.scene, "--watch", "--fresh", *self.files.options(), stderr=subprocess.DEVNULL)
        bpy.app.handlers.depsgraph_update_post.append(self.note)

    def note(self, scene, depsgraph):
        kinds = ("geometry", "transform", "shading")
        self.is_changed |= any(getattr(update, f"is_updated_{kind}") for update in depsgraph.updates for kind in kinds)

    def look(self):
        """Writes what changed; seconds until the next look, or None where the window was closed."""
        if self.process.poll() is not None:
            self.close()
            return None
        if self.is_changed and bpy.context.mode == "OBJECT" and running is None:
            Export(bpy.context, self.files.scene, self.files.settings)
            # Its own switching of modifiers is no change.
            bpy.context.view_layer.update()
            self.is_changed = False
        return self.PERIOD_S

    def close(self):
        global live
        live = None
        bpy.app.handlers.depsgraph_update_post.remove(self.note)
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait()
        self.files.remove()


live = None


class NEPHROID_OT_live(bpy.types.Operator):
    """Open a window in which the caustics follow every change of the scene, or close it"""

    bl_idname, bl_label = "nephroid.live", "Live View"

    def execute(self, context):
        global live
        if live is not None:
            live.close()
            return {"FINISHED"}
        try:
            live = LiveView(context)
        except (OSError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        bpy.app.timers.register(live.look, first_interval=LiveView.PERIOD_S)
        return {"FINISHED"}


def stop():
    """Ends what runs, when the add-on goes."""
    global running
    if running is not None:
        running.cancel()
        running = None
    if live is not None:
        if bpy.app.timers.is_registered(live.look):
            bpy.app.timers.unregister(live.look)
        live.close()


CLASSES = (NEPHROID_OT_bake, NEPHROID_OT_cancel, NEPHROID_OT_remove, NEPHROID_OT_select, NEPHROID_OT_live)
