/** Files from a file chooser or from what was dropped, folders included. */
import type { NamedFile } from "./pairing";

export interface ChosenFile extends NamedFile {
  readonly content: File;
}

/** More files than any burst has: what is behind them is not looked at. */
const MAX_FILES = 500;

/** The files that a file chooser returned. */
export function chosen(list: FileList): ChosenFile[] {
  return [...list].filter(isShown).slice(0, MAX_FILES).map((file) => named(file, file.webkitRelativePath || file.name));
}

/** The files that were dropped; folders are looked into. */
export async function dropped(transfer: DataTransfer): Promise<ChosenFile[]> {
  // entries have to be taken before the first wait: the browser empties the list afterwards
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  if (entries.length === 0) return chosen(transfer.files);
  const found: ChosenFile[] = [];
  for (const entry of entries) await collect(entry, "", found);
  return found;
}

async function collect(entry: FileSystemEntry, folder: string, found: ChosenFile[]): Promise<void> {
  if (found.length >= MAX_FILES) return;
  const path = `${folder}${entry.name}`;
  if (entry instanceof FileSystemFileEntry || entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    if (isShown(file)) found.push(named(file, path));
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    const part = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (part.length === 0) return;
    for (const inner of part) await collect(inner, `${path}/`, found);
  }
}

function named(content: File, path: string): ChosenFile {
  return { name: content.name, path, content };
}

/** Hidden files, such as those of the desktop, are no images. */
function isShown({ name }: File): boolean {
  return !name.startsWith(".");
}
