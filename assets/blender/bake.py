"""Bakes of the open scene by the program, and its window on the same scene."""

import json
import re
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

import bpy

from . import lamps, lightmaps
from .scene import Export

# What to do in Blender where the program names an option. Other options are not in the user's hands.
REMEDIES = {
    "--environment": "add a lamp that shows in renders, or let the World shine",
    "larger --map-resolution": "choose a larger Map Size",
    "--map-resolution": "choose a smaller Map Size",
    "--density": "choose a better Quality if it should be there",
}

# The Job and the LiveView that are under way.
running = live = None


def program():
    """Path of the program: the one that the preferences name, else the one that came along.

    Raises FileNotFoundError where there is none.
    """
    chosen = bpy.context.preferences.addons[__package__].preferences.program
    if chosen:
        return bpy.path.abspath(chosen)
    try:
        import nephroid
    except ImportError:
        raise FileNotFoundError("the program nephroid is not there; name it in the preferences of this add-on")
    path = nephroid.program()
    if not path.stat().st_mode & 0o100:
        # Blender unpacks wheels without this bit.
        path.chmod(0o755)
    return str(path)


class Files:
    """A folder of its own with the scene and, where it shines, the world; and the program that reads them."""

    def __init__(self, context):
        self.program = program()
        self.folder = Path(tempfile.mkdtemp(prefix="nephroid-", dir=bpy.app.tempdir))
        self.scene, settings = self.folder / "scene.glb", context.scene.nephroid
        self.options = ["--preset", settings.preset.lower(), "--map-resolution", settings.map_size.lower(),
                        "--layers", "caustic" if settings.layers == "CAUSTIC" else "caustic,direct,indirect",
                        # The file says itself what is solid.
                        "--solid-glass=off"]
        if lamps.world_shines(context.scene.world, settings.world):
            world = self.folder / "world.exr"
            lamps.write_world(context.scene.world, world)
            self.options += ["--environment", str(world)]
        self.export = Export(context, self.scene)

    def start(self, *command, stderr):
        """Starts the program, without a console window of its own."""
        return subprocess.Popen([self.program, *map(str, command)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                stderr=stderr, creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0))

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)


class Job:
    """A bake that runs beside Blender. Nothing in the file changes before `finish`."""

    def __init__(self, context):
        self.keeps_lamps = context.scene.nephroid.layers == "CAUSTIC"
        self.files = Files(context)
        self.stage, self.share = "start", 0.0
        self.process, self.failed, self.is_cancelled = None, None, False
        self.thread = threading.Thread(target=self.work, daemon=True)
        self.thread.start()

    def work(self):
        """Bakes the maps and writes them as Blender reads them. Touches nothing of Blender's."""
        maps, textures = self.files.folder / "maps", self.files.folder / "textures"
        try:
            self.run("bake", self.files.scene, "-o", maps, "--progress", "json", *self.files.options)
            if not json.loads((maps / "manifest.json").read_text())["maps"]:
                raise RuntimeError("no light falls on a surface by way of glass, mirrors or water; give an object such "
                                   "a material, or see which collections Lamps and Objects name")
            self.run("export", maps, "--format", "exr", "--bits", "32", "--units", "E/pi", "-o", textures)
        except (OSError, ValueError, RuntimeError) as error:
            self.failed = str(error)

    def run(self, *command):
        """Runs the program, and reads its progress, warnings and error, line by line."""
        self.process = self.files.start(*command, stderr=subprocess.PIPE)
        error = None
        for line in self.process.stderr:
            kind, _, text = line.decode(errors="replace").strip().partition(": ")
            if kind.startswith("{"):
                told = json.loads(line)
                self.stage, self.share = told["stage"], told["done"] / max(told["total"], 1)
            elif kind == "warning" and "so it is a thin pane" not in text:
                self.files.export.messages.append((None, self.in_blender(text)))
            elif kind == "error":
                error = self.in_blender(text)
        if self.process.wait() != 0 or self.is_cancelled:
            raise RuntimeError(error or f"the program ended with {self.process.returncode}")

    def in_blender(self, text):
        """A message in terms of the panel, without the file, of which the user does not know."""
        text = text.replace(f"{self.files.scene}: ", "").removeprefix("--memory: ")
        what, _, remedy = text.rpartition("; ")
        if not what or "--" not in remedy:
            return text
        instead = [there for option, there in REMEDIES.items() if option in remedy]
        return "; ".join([what, *instead[:1]])

    def cancel(self):
        """Ends it; nothing has been changed."""
        self.is_cancelled = True
        if self.process is not None:
            self.process.kill()
        self.thread.join()
        self.files.remove()

    def finish(self, context):
        """Puts the maps back; messages as (level, object name or '', text)."""
        self.thread.join()
        export = self.files.export
        found = [message for owner, text in export.messages for message in addressed("WARNING", owner, text)]
        try:
            if self.failed:
                return found + addressed("ERROR", None, self.failed)
            count = lightmaps.put_back(context, export, self.files.folder, self.keeps_lamps,
                                       lambda name, text: found.append(("WARNING", name, text)))
            return found + [("INFO", "", f"{count} light maps")]
        except (OSError, ValueError, RuntimeError) as error:
            lightmaps.remove(context)
            return found + [("ERROR", "", str(error))]
        finally:
            self.files.remove()


def addressed(level, owner, text):
    """A message for each object that it is about: the owner, (kind, name), or what the program names in its text."""
    names, named = [], [*re.findall(r"(node|light|mesh|material) `([^`]*)`", text), ("node", text.partition(": ")[0])]
    for kind, name in [owner] if owner else named:
        for item in bpy.context.scene.objects:
            materials = [slot.material.name_full for slot in item.material_slots if slot.material]
            meant = {"material": materials, "mesh": [item.name, getattr(item.data, "name", None)]}
            if name in meant.get(kind, [item.name]):
                names.append(item.name)
    return [(level, name, text.removeprefix(f"{name}: ")) for name in dict.fromkeys(names)] or [(level, "", text)]


def report(operator, context, messages):
    """Shows messages in Blender's reports and in the panel."""
    shown = context.window_manager.nephroid_messages
    shown.clear()
    for level, name, text in messages:
        operator.report({level}, f"{name}: {text}" if name else text)
        if level != "INFO":
            message = shown.add()
            message.level, message.object, message.text = level, name, text


class WhileIdle:
    """Operators that change the scene wait for the bake."""

    @classmethod
    def poll(cls, context):
        return running is None and context.mode == "OBJECT"


class NEPHROID_OT_bake(WhileIdle, bpy.types.Operator):
    """Bake the light that glass, mirrors and water throw onto the scene, and show it on the surfaces"""

    bl_idname, bl_label = "nephroid.bake", "Bake Caustics"
    bl_options = {"REGISTER", "UNDO"}

    def end(self, context):
        global running
        job, running = running, None
        if job.is_cancelled:
            job.cancel()
            report(self, context, [("INFO", "", "Cancelled: nothing was changed")])
            return {"CANCELLED"}
        messages = job.finish(context)
        report(self, context, messages)
        return {"CANCELLED"} if messages[-1][0] == "ERROR" else {"FINISHED"}

    def execute(self, context):
        return self.invoke(context, None)

    def invoke(self, context, event):
        """Bakes beside Blender, or at once where a script asks and there is no event."""
        global running
        try:
            running = Job(context)
        except (OSError, RuntimeError) as error:
            report(self, context, [("ERROR", "", str(error))])
            return {"CANCELLED"}
        if event is None:
            return self.end(context)
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        running.is_cancelled |= event.type == "ESC"
        if event.type not in {"TIMER", "ESC"}:
            return {"PASS_THROUGH"}
        manager = context.window_manager
        if running.thread.is_alive() and not running.is_cancelled:
            manager.progress_update(round(100 * running.share))
            for area in context.screen.areas if context.screen else ():
                if area.type == "PROPERTIES":
                    area.tag_redraw()
            return {"PASS_THROUGH"}
        manager.event_timer_remove(self.timer)
        manager.progress_end()
        return self.end(context)

    def cancel(self, context):
        """Blender calls this when another file is opened."""
        stop()


class NEPHROID_OT_cancel(bpy.types.Operator):
    """End the bake and change nothing"""

    bl_idname, bl_label = "nephroid.cancel", "Cancel"

    def execute(self, context):
        if running is not None:
            running.is_cancelled = True
        return {"FINISHED"}


class NEPHROID_OT_remove(WhileIdle, bpy.types.Operator):
    """Take all light maps away again: images, coordinates, nodes and modifiers"""

    bl_idname, bl_label = "nephroid.remove", "Remove Light Maps"
    bl_options = {"REGISTER", "UNDO"}

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

    def __init__(self, context):
        self.is_changed, self.files = False, Files(context)
        self.process = self.files.start("view", self.files.scene, "--watch", "--fresh", *self.files.options,
                                        stderr=subprocess.DEVNULL)
        bpy.app.handlers.depsgraph_update_post.append(self.note)
        bpy.app.timers.register(self.look)

    def note(self, scene, depsgraph):
        self.is_changed |= any(update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading
                               for update in depsgraph.updates)

    def look(self):
        """Writes what changed; time until the next look [s], or None where the window was closed."""
        if live is self and self.process.poll() is not None:
            self.close()
        if live is not self:
            return None
        if self.is_changed and bpy.context.mode == "OBJECT" and running is None:
            Export(bpy.context, self.files.scene)
            # Its own switching of modifiers is no change.
            bpy.context.view_layer.update()
            self.is_changed = False
        return 0.3

    def close(self):
        global live
        live = None
        # Opening another file has taken it away.
        if self.note in bpy.app.handlers.depsgraph_update_post:
            bpy.app.handlers.depsgraph_update_post.remove(self.note)
        self.process.terminate()
        self.process.wait()
        self.files.remove()


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
        return {"FINISHED"}


def stop():
    """Ends what runs, when the add-on goes."""
    global running
    if running is not None:
        running.cancel()
        running = None
    if live is not None:
        live.close()


CLASSES = (NEPHROID_OT_bake, NEPHROID_OT_cancel, NEPHROID_OT_remove, NEPHROID_OT_select, NEPHROID_OT_live)
