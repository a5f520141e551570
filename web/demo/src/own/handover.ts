// A file that was dropped on one page of the demo and is opened on the other: kept in the browser in between.

const DATABASE = "dynaskin-handover";
const STORE = "files";
const KEY = "avatar";

function open(): Promise<IDBDatabase> {
  const request = indexedDB.open(DATABASE, 1);
  request.onupgradeneeded = () => request.result.createObjectStore(STORE);
  return settled(request);
}

function settled<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () =>
      reject(request.error ?? new Error("The browser does not store files here."));
  });
}

/** Leaves a file for the other page. */
export async function leaveFile(file: File): Promise<void> {
  const database = await open();
  await settled(database.transaction(STORE, "readwrite").objectStore(STORE).put(file, KEY));
  database.close();
}

/** Takes the file that was left, once; null if there is none. */
export async function takeFile(): Promise<File | null> {
  const database = await open();
  const store = database.transaction(STORE, "readwrite").objectStore(STORE);
  const file: unknown = await settled(store.get(KEY));
  await settled(store.delete(KEY));
  database.close();
  return file instanceof File ? file : null;
}
