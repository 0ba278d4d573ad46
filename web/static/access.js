// A link or token that was just made is copied by a press of a button; without the script it can be selected.
const button = document.getElementById("copy");
const secret = document.getElementById("secret");
if (button && secret && navigator.clipboard) {
    button.hidden = false;
    button.addEventListener("click", async () => {
        const told = document.getElementById("copied");
        try {
            await navigator.clipboard.writeText(secret.value);
            told.textContent = told.dataset.done;
        } catch {
            secret.select();
            told.textContent = told.dataset.not;
        }
    });
}
